"""The command line. app: what there is to call; one module per group of commands; render: how answers are shown."""
