"""Networks this small are slower with two threads than with one, above all on a busy machine."""

import torch

torch.set_num_threads(1)
