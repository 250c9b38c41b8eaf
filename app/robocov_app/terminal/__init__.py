"""Terminal services of the commands: values of options, tables, progress, Ctrl-C."""
