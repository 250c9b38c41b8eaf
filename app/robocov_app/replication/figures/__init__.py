"""Figures of the study.

- `paper_figures`: the paper's figures 1 to 8
- `claim_plots`, `comparison_plots`: plots of the paper's claims
- `beyond_plots`, `degradation_plot`, `height_plot`: plots of the results beyond the paper
- `figure_files`: writes all of them, as PNG, SVG and PDF, in light and dark
"""
