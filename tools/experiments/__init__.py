"""The paper's experiment, rebuilt: simulated captures with known truth, estimators side by side.

Run as `python3 run.py experiments`; docs/method/experiments.md describes it and its results.
"""
