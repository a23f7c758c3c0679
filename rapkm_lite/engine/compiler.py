"""Numba's compiler for kernels and their parts: less work before the first result, wider vector registers after it.

Most of a first run's time goes to Python code of Numba, not to LLVM, and grows with the lines that are compiled.
"""

from __future__ import annotations

from types import BuiltinFunctionType
from typing import ClassVar

from llvmlite import binding as llvm
from numba import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.typing.context import Context
from numba.extending import models, register_model

IDLE = {"inline_closure_likes", "nopython_rewrites"}
"""Passes over every line that look for what kernels do without: closures and array expressions."""


class Operator(types.Function):
    """A builtin that looks up once, and not on every line again, what it returns for its arguments."""

    def __init__(self, templates):
        super().__init__(templates)
        self.known: dict = {}

    def get_call_type(self, context, args, kws):
        if kws:
            return super().get_call_type(context, args, kws)
        if args not in self.known:
            self.known[args] = super().get_call_type(context, args, kws)
        return self.known[args]


register_model(Operator)(models.OpaqueModel)


class Rules(Context):
    """Numba's typing context, with operators that remember."""

    operators: ClassVar[dict] = {}

    def __init__(self, rules):
        self.__dict__ = rules.__dict__

    def resolve_value_type(self, val):
        if not isinstance(val, BuiltinFunctionType):
            return super().resolve_value_type(val)
        if val not in self.operators:
            found = super().resolve_value_type(val)
            self.operators[val] = Operator(found.templates) if type(found) is types.Function else found
        return self.operators[val]


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


class Part(Whole):
    """What only kernels call: it is linked into them, and needs no machine code of its own."""

    level = 2
    codegen = property(lambda self: self)

    def set_env(self, name, env):
        """Without machine code there is nothing to enter."""

    def _finalize_final_module(self):
        self._finalized = True


class Wide(Compiler):
    """Numba's compiler, free to use vector registers of 512 bits: on processors of Intel it stops at 256, with which
    runs side by side take a third longer."""

    def __init__(self, rules, target, *rest):
        super().__init__(Rules(rules), target, *rest)
        context = self.state.targetctx
        context.typing_context = self.state.typingctx
        declare = context.declare_function

        def wide(module, description):
            function = declare(module, description)
            # As text: llvmlite has no word for it.
            set.add(function.attributes, '"prefer-vector-width"="512"')
            return function

        context.declare_function = wide

    def define_pipelines(self):
        state = self.state
        library = Part if state.flags.no_cpython_wrapper else Whole
        state.library = library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        pipelines = super().define_pipelines()
        for manager in pipelines:
            manager.passes = [step for step in manager.passes if step[0].name() not in IDLE]
        return pipelines
