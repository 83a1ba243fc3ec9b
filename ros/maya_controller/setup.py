"""What catkin installs of this package's Python; it is called by catkin, never by hand."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

packages = ["maya_controller"] + ["maya_controller." + name for name in ("config", "hardware", "simulation")]
setup(**generate_distutils_setup(packages=packages, package_dir={"": "src"}))
