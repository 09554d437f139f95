"""Machine code of numerical kernels, kept between runs."""
