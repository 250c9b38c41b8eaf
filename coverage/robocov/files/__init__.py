"""Files: strict reading, and atomic writing.

- `strictjson`: JSON and TOML, with the line and the column of each issue
- `json_positions`: lines and columns of keys and values in JSON
- `documents`: JSON documents that are checked against models of their content
- `array_files`: arrays in .npz files, and a cache for arrays
- `csv_cells`: cells of CSV files
- `writing`: files that are replaced atomically
- `result_folder`: folders of results that are replaced atomically
- `result_names`: names of the files in the folder of a result
- `folder_lock`: locks on folders
- `paths`: checks of paths from users
- `cache_folders`: folders of caches
"""
