"""What the dashboard prints once it serves, and the runner waits for in its log."""

LIVE_PAGE = 'live page: '
"""Stands before the address of the live page."""
