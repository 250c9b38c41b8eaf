"""Reports: results as one self-contained HTML page, with an interactive replay."""
