"""What `./ja` needs before any package is installed: standard library only, Python 3.8 on."""
