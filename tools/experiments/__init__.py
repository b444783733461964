"""The experiments of Ono et al. 2019, repeated: estimators on simulated captures with known truth.

Run as `python3 run.py experiments`; docs/method/experiments.md describes them and their results.
"""
