"""The plots of a report, drawn by matplotlib and embedded as SVG."""
