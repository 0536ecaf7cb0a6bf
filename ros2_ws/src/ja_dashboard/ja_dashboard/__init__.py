"""The live page: what the head sees and does, in a browser."""
