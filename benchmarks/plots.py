"""One plot a benchmark: a function of the program's name draws its report into a PNG file."""
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
