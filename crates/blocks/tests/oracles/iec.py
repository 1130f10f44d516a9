"""Blocks of IEC 61131-3, written from its tables of standard function blocks."""

from common import Input, Oracle, Output


class RTrig(Oracle):
    """Table 44, R_TRIG: Q := CLK AND NOT M; M := CLK, with M initially FALSE."""

    NAME = "R_TRIG"
    INPUTS = [Input("CLK", "BOOL")]
    OUTPUTS = [Output("Q", "BOOL")]

    def __init__(self):
        self.m = False

    def step(self, i, cycle):
        q = i.CLK and not self.m
        self.m = i.CLK
        return [q]
