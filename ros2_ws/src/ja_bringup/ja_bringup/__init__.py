"""The commands of `./ja`."""
