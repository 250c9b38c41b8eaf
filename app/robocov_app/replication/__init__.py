"""The paper's figures on environments of the same kinds, and its claims tested on many maps.

- `design`: the extent of the study, its contenders, maps and sweeps
- `execution`: the parts of the study, executed in order; a forecast of their number and time
- `results`: outcomes of the runs, reference placements and step times
- `claims`: criteria, and the verdicts on the paper's claims and on those beyond it
- `evidence`: summaries and comparisons of the results of each controller
- `figures`: figures and plots of the results
- `pages`: the HTML pages that present everything
- `formatting`: numbers, intervals and medians as text
- `assets`: templates, styles, captions, gain grids and profiles of controllers
"""
