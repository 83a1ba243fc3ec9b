"""Tells catkin which Python packages to install. Only catkin calls it."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["maya_process"], package_dir={"": "src"}))
