from setuptools import find_packages, setup

PACKAGE = 'ja_perception'
DATA = ('yaml', 'xml', 'obj', 'png', 'jpg', 'npz', 'tflite', 'caffemodel', 'prototxt', 'txt', 'md')

setup(
    name=PACKAGE,
    version='0.1.0',
    description='Salient features, faces and cameras: from image_raw to detections.',
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
    entry_points={
        'console_scripts': [
            'salient_feature_detector = ja_perception.salient_feature_detector_node:main',
            'camera = ja_perception.camera_node:main',
            'echo_detections = ja_perception.echo_detections_node:main',
        ],
    },
)
