"""Entropy decoder of codec small: adaptive rANS symbols and plain bit fields."""

import struct

from ptk.records import BadFile, Bits, unzigzag

SYMBOLS = 16
PROBABILITY_BITS = 15
LOWEST = 1 << 16
WIDE = 15  # numbers of this many bits and more store their width explicitly


class Model:
    """Cumulative symbol frequencies, which adapt to the symbols decoded."""

    def __init__(self):
        self.below = [i << PROBABILITY_BITS - 4 for i in range(SYMBOLS + 1)]
        self.count = 0

    def rate(self):
        for rate, end in ((2, 2), (3, 6), (4, 20), (5, 60), (6, 95)):
            if self.count < end:
                return rate
        return 7

    def find(self, slot):
        return max(symbol for symbol in range(SYMBOLS) if self.below[symbol] <= slot)

    def update(self, symbol):
        rate = self.rate()
        for i in range(SYMBOLS):
            target = i if i <= symbol else (1 << PROBABILITY_BITS) - SYMBOLS + i
            self.below[i] += target - self.below[i] >> rate
        self.count += 1


class Values:
    """The symbols and bit fields of a page. A model is created when its name is first used."""

    def __init__(self, page):
        (size,) = struct.unpack_from("<I", page)
        self.field_bytes = size
        self.fields = Bits(page[4 : 4 + size])
        words = page[4 + size :]
        if len(words) < 8 or len(words) % 2 != 0:
            raise BadFile("a page without its symbols")
        self.words = iter(struct.unpack(f"<{len(words) // 2}H", words))
        self.states = [next(self.words) | next(self.words) << 16 for _ in range(2)]
        self.models = {}

    def symbol(self, *name):
        return self.mixed_symbol(name)

    def mixed_symbol(self, *names):
        """Reads a symbol with the mean of the models of one or two names."""
        models = [self.models.setdefault(name, Model()) for name in names]
        model = models[0]
        if len(models) == 2:
            model = Model()
            model.below = [(a + b + 1) // 2 for a, b in zip(*(one.below for one in models))]
        state = self.states.pop(0)
        slot = state & (1 << PROBABILITY_BITS) - 1
        symbol = model.find(slot)
        state = (model.below[symbol + 1] - model.below[symbol]) * (state >> PROBABILITY_BITS) + slot - model.below[symbol]
        if state < LOWEST:
            state = state << 16 | next(self.words)
        self.states.append(state)
        for one in models:
            one.update(symbol)
        return symbol

    def flag(self, *name):
        return self.symbol(*name) & 1

    def field(self, bits):
        return self.fields.take(bits)

    def magnitude(self, *name):
        return self.mixed_magnitude(name)

    def mixed_magnitude(self, *names):
        width = self.mixed_symbol(*names)
        if width == 0:
            return 0
        if width == WIDE:
            width += self.field(6)
        low = min(width - 1, 32)
        high = self.field(width - 1 - low)
        return (1 << width - 1 - low | high) << low | self.field(low)

    def difference(self, *name):
        return unzigzag(self.magnitude(*name))

    def mixed_difference(self, *names):
        return unzigzag(self.mixed_magnitude(*names))

    def whole(self):
        return (next(self.words, None) is None and self.states == [LOWEST] * 2
                and (self.fields.at + 7) // 8 == self.field_bytes)
