from setuptools import find_packages, setup

PACKAGE = 'ja_diagnostics'
DATA = ('yaml', 'xml', 'obj', 'png', 'jpg', 'npz', 'tflite', 'caffemodel', 'prototxt', 'txt', 'md')

setup(
    name=PACKAGE,
    version='0.1.0',
    description='Is this machine and this graph in order? Doctor, topic table, faults, soak.',
    license='Apache-2.0',
    maintainer='The Joint Attention team',
    maintainer_email='joint-attention@example.org',
    packages=find_packages(include=[PACKAGE, f'{PACKAGE}.*']),
    package_data={PACKAGE: [f'**/*.{extension}' for extension in DATA]},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
    ],
    zip_safe=False,
)
