"""The live page: what it hears, how it is served, what it looks like."""

LIVE_PAGE = 'live page: '
"""What stands before the address when the page is served."""

PICTURE_URL = '/picture.jpg'
