"""What the commands share: values of options, tables, progress, Ctrl-C."""
