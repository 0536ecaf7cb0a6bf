"""Build the package; its name, version, licence and maintainer stand in package.xml."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

MANIFEST = ElementTree.parse(Path(__file__).with_name('package.xml')).getroot()
PACKAGE = MANIFEST.findtext('name')
DATA = (
    'yaml', 'xml', 'obj', 'png', 'jpg', 'npz', 'onnx', 'caffemodel', 'prototxt', 'txt', 'md',
    'js', 'css', 'urdf',
)  # fmt: skip

setup(
    name=PACKAGE,
    version=MANIFEST.findtext('version'),
    description=MANIFEST.findtext('description'),
    license=MANIFEST.findtext('license'),
    maintainer=MANIFEST.findtext('maintainer'),
    maintainer_email=MANIFEST.find('maintainer').get('email'),
    url=MANIFEST.findtext('url'),
    packages=find_packages(include=[PACKAGE, f'{PACKAGE}.*']),
    package_data={PACKAGE: ['py.typed', *(f'**/*.{extension}' for extension in DATA)]},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
    ],
    zip_safe=False,
    # From this `colcon test` knows that it has to start pytest; see setup.cfg.
    extras_require={'test': ['pytest']},
)
