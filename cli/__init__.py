"""The command line and the shell."""
