"""What several packages need: geometry, statistics, configuration, topics, codecs, base node."""
