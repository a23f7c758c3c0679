"""Numba's compiler for kernels and their parts: less work before the first result, wider vector registers after it.
What a user compiles, in a law or elsewhere, Numba compiles as usual.

Most of a first run's time goes to Python code of Numba, not to LLVM, and grows with the lines that are compiled.
"""

from __future__ import annotations

import operator
from types import BuiltinFunctionType
from typing import ClassVar

from llvmlite import binding as llvm
from numba import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.cpu import CPUContext
from numba.core.typing.context import Context
from numba.extending import models, register_model

IDLE = {"inline_closure_likes", "inline_overloads", "ir_legalization", "nopython_rewrites"}
"""Slow passes over every line that look for what kernels do without.  That of legalization says where variables end,
too, which matters to those with reference counting."""


class Operator(types.Function):
    """A builtin that looks up once, and not on every line again, what it returns for its arguments."""

    def __init__(self, templates):
        super().__init__(templates)
        self.known: dict = {}

    def get_call_type(self, context, args, kws):
        if kws:
            return super().get_call_type(context, args, kws)
        args = tuple(map(types.unliteral, args))
        if args not in self.known:
            self.known[args] = super().get_call_type(context, args, kws)
        return self.known[args]


register_model(Operator)(models.OpaqueModel)


class Rules(Context):
    """Numba's typing context, with operators that remember."""

    operators: ClassVar[dict] = {}

    def __init__(self, rules):
        rules.refresh()
        self.__dict__ = rules.__dict__

    def refresh(self):
        """Nothing has come since; and what Numba adds to, are its own operators."""

    def _lookup_global(self, gv):
        found = super()._lookup_global(gv)
        builtin = isinstance(gv, BuiltinFunctionType) or gv is bool or gv is range
        if not builtin or type(found) is not types.Function:
            return found
        if gv not in self.operators:
            self.operators[gv] = Operator(found.templates)
        return self.operators[gv]


def _place(context, builder, kind, array, index, number):
    """Pointer to an item of a flat array.

    Elsewhere a negative index counts from the end.  Kernels have none: to test each index for that would take a tenth
    of a first run's time, and prevent vectorization.
    """
    data = context.data_model_manager[kind].get(builder, array, "data")
    return builder.gep(data, [context.cast(builder, index, number, types.intp)], inbounds=True)


def _take(context, builder, kinds, values):
    place = _place(context, builder, kinds[0], values[0], values[1], kinds[1])
    return context.unpack_value(builder, kinds[0].dtype, place)


def _put(context, builder, kinds, values):
    place = _place(context, builder, kinds[0], values[0], values[1], kinds[1])
    item = context.cast(builder, values[2], kinds[2], kinds[0].dtype)
    context.pack_value(builder, kinds[0].dtype, item, place)


ITEMS = {operator.getitem: _take, operator.setitem: _put}


class Processor(CPUContext):
    """Numba's context of the processor, with items of flat arrays at hand and vector registers of 512 bits: on
    processors of Intel Numba stops at 256, with which runs side by side take a third longer."""

    def __init__(self, target):
        target.refresh()
        self.__dict__ = target.__dict__

    def refresh(self):
        """As `Rules.refresh`."""

    def declare_function(self, module, description):
        function = super().declare_function(module, description)
        # As text: llvmlite has no word for it.
        set.add(function.attributes, '"prefer-vector-width"="512"')
        return function

    def get_function(self, fn, sig, _firstcall=True):
        word = getattr(fn, "typing_key", None)
        if word in ITEMS and _flat(*sig.args[:2]):
            return lambda builder, values, loc=None: ITEMS[word](self, builder, sig.args, values)
        return super().get_function(fn, sig, _firstcall)


def _flat(array, index):
    return (
        isinstance(array, types.Array) and array.layout == "C" and array.ndim == 1 and isinstance(index, types.Integer)
    )


class Whole(JITCodeLibrary):
    """Optimized once, with all that it calls.  Numba begins with each function alone, which takes time and leaves up to
    twice as many instructions."""

    level = 3

    def _optimize_functions(self, ll_module):
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self):
        tuning = llvm.create_pipeline_tuning_options(speed_level=self.level)
        tuning.loop_vectorization = True
        builder = llvm.create_pass_builder(self._codegen._tm, tuning)
        passes = builder.getModulePassManager()
        passes.add_refprune_pass()
        passes.run(self._final_module, builder)

    def serialize_using_object_code(self):
        """For the cache, machine code and the names in it: nothing is linked with a kernel, and its bitcode would take
        longer to read than all the rest."""
        names = (f'define void @"{function.name}"() {{ ret void }}' for function in self.get_defined_functions())
        return self.name, "object", (self._get_compiled_object(), llvm.parse_assembly("\n".join(names)).as_bitcode())


class Part(Whole):
    """What only kernels call: it is linked into them, and needs no machine code of its own."""

    level = 2
    codegen = property(lambda self: self)

    def set_env(self, name, env):
        """Without machine code there is nothing to enter."""

    def _optimize_final_module(self):
        # Nor does it raise, for which a place of its globals would be kept, and filled whenever the kernel is loaded.
        for place in self._final_module.global_variables:
            if place.name.startswith("_ZN08NumbaEnv"):
                place.linkage = "internal"
        super()._optimize_final_module()

    def _finalize_final_module(self):
        self._finalized = True


class Wide(Compiler):
    """Numba's compiler for kernels and their parts."""

    def __init__(self, rules, target, *rest):
        super().__init__(Rules(rules), Processor(target), *rest)
        self.state.targetctx.typing_context = self.state.typingctx

    def define_pipelines(self):
        state = self.state
        library = Part if state.flags.no_cpython_wrapper else Whole
        state.library = library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        pipelines = super().define_pipelines()
        for manager in pipelines:
            idle = IDLE - {"ir_legalization"} if state.flags.nrt else IDLE
            manager.passes = [step for step in manager.passes if step[0].name() not in idle]
        return pipelines
