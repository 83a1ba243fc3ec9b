"""What catkin installs of this package's Python; it is called by catkin, never by hand."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["maya_process"], package_dir={"": "src"}))
