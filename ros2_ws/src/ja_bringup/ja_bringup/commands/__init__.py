"""One file for each group of commands of `./ja`; each has `register(app)`."""
