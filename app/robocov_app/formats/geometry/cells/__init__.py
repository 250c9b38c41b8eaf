"""Grid cells: conversion to free space (`grid_map`, `vectorize`) and from free space (`rasterize`)."""
