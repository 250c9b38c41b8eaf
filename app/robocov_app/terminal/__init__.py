"""Terminal services of the commands.

- `arguments`: the words of a command line, parsed
- `output`, `progress`: answers, tables, small files and progress
- `interruption`: Ctrl-C that keeps what has been computed
- `standard_streams`, `supervision`: protection against controllers that close streams or end Python
- `file_watching`: files that are checked again when they change
"""
