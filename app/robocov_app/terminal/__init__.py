"""Terminal services of the commands.

- `arguments`: parses command lines
- `output`, `progress`: answers, tables, small files and progress
- `interruption`: handling of Ctrl+C that keeps the results so far
- `standard_streams`, `supervision`: protection against controllers that close streams or terminate Python
- `file_watching`: files that are checked again when they change
"""
