"""The command line: parse flags, call the API, print."""
