"""Convert a network of MediaPipe's from TensorFlow Lite to ONNX, which OpenCV 4.6 can read.

    pip install onnx==1.23.2 tflite==2.18.0 numpy
    python tools/convert_face_models.py face_landmark.tflite face_landmark.onnx

OpenCV reads ONNX from 4.5 on, TFLite from 4.8. The layers and the weights stay as they are:
weights of 16 bits are written with 32, which holds each of them exactly, and channels come before
rows and columns (NCHW), as ONNX wants them. `tests/ja_perception/test_face_models.py` has outputs
of the originals to compare with.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import onnx
import tflite
from numpy.typing import NDArray
from onnx import NodeProto, TensorProto, helper, numpy_helper
from tflite import BuiltinOperator as Op

_TYPES = {0: np.float32, 1: np.float16, 2: np.int32}
# Read by OpenCV 4.5 and newer.
_OPSET, _IR_VERSION = 11, 6


class Converter:
    """One TFLite file, walked operator by operator; an operator it does not know is an error."""

    def __init__(self, data: bytes) -> None:
        self._model = tflite.Model.GetRootAs(data, 0)
        self._graph = self._model.Subgraphs(0)
        self._weights: dict[str, NDArray] = {}

    def convert(self, name: str) -> onnx.ModelProto:
        """Return the same network with an input (1, 3, H, W), and the outputs as NCHW."""
        nodes = [node for i in range(self._graph.OperatorsLength()) for node in self._nodes(i)]
        (source,) = self._graph.InputsAsNumpy()
        _, height, width, channels = self._shape(source)
        image = (1, channels, height, width)
        inputs = [
            helper.make_tensor_value_info(self._name(source), TensorProto.FLOAT, image),
        ]
        outputs = [
            helper.make_tensor_value_info(self._name(i), TensorProto.FLOAT, self._nchw(i))
            for i in self._graph.OutputsAsNumpy()
        ]
        weights = [numpy_helper.from_array(array, n) for n, array in self._weights.items()]
        graph = helper.make_graph(nodes, name, inputs, outputs, weights)
        opset = [helper.make_opsetid('', _OPSET)]
        model = helper.make_model(
            graph, opset_imports=opset, ir_version=_IR_VERSION, producer_name='convert_face_models'
        )
        onnx.checker.check_model(model, full_check=True)
        return model

    def _name(self, tensor: int) -> str:
        return self._graph.Tensors(tensor).Name().decode()

    def _shape(self, tensor: int) -> list[int]:
        return self._graph.Tensors(tensor).ShapeAsNumpy().tolist()

    def _nchw(self, tensor: int) -> list[int]:
        shape = self._shape(tensor)
        return [shape[i] for i in (0, 3, 1, 2)] if len(shape) == 4 else shape

    def _array(self, tensor: int) -> NDArray:
        data = self._model.Buffers(self._graph.Tensors(tensor).Buffer()).DataAsNumpy()
        return data.view(_TYPES[self._graph.Tensors(tensor).Type()]).reshape(self._shape(tensor))

    def _nodes(self, index: int) -> Iterator[NodeProto]:
        operator = self._graph.Operators(index)
        code = self._model.OperatorCodes(operator.OpcodeIndex())
        kind = max(code.BuiltinCode(), code.DeprecatedBuiltinCode())
        inputs = operator.InputsAsNumpy().tolist()
        (target,) = operator.OutputsAsNumpy().tolist()
        names, name = [self._name(i) for i in inputs], self._name(target)
        options = operator.BuiltinOptions()

        if kind == Op.DEQUANTIZE:
            self._weights[name] = self._array(inputs[0]).astype(np.float32)
        elif kind in (Op.CONV_2D, Op.DEPTHWISE_CONV_2D):
            for tensor, weight in zip(inputs[1:], names[1:], strict=True):
                if weight not in self._weights:  # with 32 bits already
                    self._weights[weight] = self._array(tensor)
            kernel = self._weights[names[1]]
            deep = kind == Op.DEPTHWISE_CONV_2D
            # (1, h, w, channels) for each channel alone, else (out, h, w, in).
            self._weights[names[1]] = kernel.transpose((3, 0, 1, 2) if deep else (0, 3, 1, 2))
            options_type = tflite.DepthwiseConv2DOptions if deep else tflite.Conv2DOptions
            yield helper.make_node(
                'Conv',
                names,
                [name],
                kernel_shape=kernel.shape[1:3],
                group=kernel.shape[3] if deep else 1,
                **_window(_read(options_type, options)),
            )
        elif kind == Op.MAX_POOL_2D:
            pool = _read(tflite.Pool2DOptions, options)
            shape = (pool.FilterHeight(), pool.FilterWidth())
            yield helper.make_node('MaxPool', names, [name], kernel_shape=shape, **_window(pool))
        elif kind == Op.PAD:
            # ONNX: all beginnings, then all ends, in the order of NCHW.
            amounts = self._array(inputs[1])[[0, 3, 1, 2]].T.astype(np.int64).ravel()
            self._weights[f'{name}/pads'] = amounts
            yield helper.make_node('Pad', [names[0], f'{name}/pads'], [name], mode='constant')
        elif kind == Op.PRELU:
            # One slope a channel: (1, 1, channels) here, (channels, 1, 1) there.
            self._weights[names[1]] = self._array(inputs[1]).transpose(2, 0, 1)
            yield helper.make_node('PRelu', names, [name])
        elif kind in (Op.RELU, Op.ADD):
            if kind == Op.ADD:
                _refuse_fused(_read(tflite.AddOptions, options))
            yield helper.make_node('Relu' if kind == Op.RELU else 'Add', names, [name])
        elif kind == Op.RESHAPE:
            # What is reshaped goes by rows, columns and then channels.
            shape = np.array(self._shape(target), np.int64)
            self._weights[f'{name}/shape'] = shape
            yield helper.make_node('Transpose', names[:1], [f'{name}/nhwc'], perm=(0, 2, 3, 1))
            yield helper.make_node('Reshape', [f'{name}/nhwc', f'{name}/shape'], [name])
        elif kind == Op.CONCATENATION:
            _refuse_fused(_read(tflite.ConcatenationOptions, options))
            yield helper.make_node('Concat', names, [name], axis=1)
        else:
            raise SystemExit(f'operator {kind} of {name} has no conversion here')


def _read(options_type: type, table: object) -> object:
    options = options_type()
    options.Init(table.Bytes, table.Pos)
    return options


def _refuse_fused(options: object) -> None:
    if options.FusedActivationFunction() != tflite.ActivationFunctionType.NONE:
        raise SystemExit('an operator with a fused activation has no conversion here')


def _window(options: object) -> dict:
    _refuse_fused(options)
    padding = 'SAME_UPPER' if options.Padding() == tflite.Padding.SAME else 'VALID'
    return {'strides': (options.StrideH(), options.StrideW()), 'auto_pad': padding}


if __name__ == '__main__':
    given, made = map(Path, sys.argv[1:])
    model = Converter(given.read_bytes()).convert(made.stem)
    made.write_bytes(model.SerializeToString(deterministic=True))
    print(f'{made}: {made.stat().st_size} bytes')
