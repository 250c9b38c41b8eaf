"""The plots of a report, drawn with matplotlib and embedded as SVG."""
