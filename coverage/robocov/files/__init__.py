"""Files: strict reading, and atomic writing.

- `strictjson`: JSON and TOML, with the line and the column of each issue
- `array_files`: arrays in .npz files, and a cache of them
- `csv_cells`: cells of CSV files
- `writing`: files that are replaced atomically
- `result_folder`: folders of results that are replaced atomically
- `result_names`: names of the files in the folder of a result
- `folder_lock`: locks on folders
- `cache_folders`: folders of caches
"""
