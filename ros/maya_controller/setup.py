"""Tells catkin which Python packages to install. Only catkin calls it."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

packages = ["maya_controller"] + ["maya_controller." + name for name in ("config", "hardware", "simulation")]
setup(**generate_distutils_setup(packages=packages, package_dir={"": "src"}))
