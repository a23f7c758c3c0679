"""The students' formula sheet: one A4 page as PDF, formulas only, no numbers.

    python docs/teaching/formula_sheet.py            # writes formula_sheet.pdf
    python docs/teaching/formula_sheet.py sheet.pdf

Numbers are the chapter's; a star marks a formula that is corrected against the print (notebooks/errata.md).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

ROWS = [
    ("The machine", "", ""),
    ("counting", "*", r"$n = 2N,\ \ r = 2(N-1),\ \ \delta = n-r = 2,\ \ m = N$ drives"),
    ("constraints", "(1)", r"$h(q)=0,\quad J\dot q=0$, hence $J\ddot q+\dot J\dot q=0$"),
    ("cut tree", "(2)", r"$G\ddot q+C\dot q+Q+J^T\lambda=u,\quad u=(c,\,0)$"),
    (
        "independent joints",
        "(4), (5)",
        r"$J_1\dot q_1+J_2\dot q_2=0,\quad \dot q=F\dot q_2,\quad JF=0,"
        r"\quad F=(-J_1^{-1}J_2;\ I)$, the rows of $q_1$ first",
    ),
    ("minimal form", "(6)", r"$\bar G\ddot q_2+\bar C\dot q_2+\bar Q=A^Tc,\quad \dot q_a=A\dot q_2$"),
    ("its matrices", "(7)", r"$\bar G=F^TGF,\quad \bar C=F^T(CF+G\dot F),\quad \bar Q=F^TQ$"),
    ("Actuation", "", ""),
    ("control system", "(8), (9)", r"drift $-\bar G^{-1}(\bar C\dot q_2+\bar Q)$, fields: columns of $\bar G^{-1}A^T$"),
    (
        "degree of actuation",
        "(10)*",
        r"$\alpha=\mathrm{rank}\,A$; input singularity where it changes, here $\alpha<\delta$",
    ),
    (
        "end-effector coordinates",
        "",
        r"row $i$ of $A$: $d_i^T/(a_i\times d_i)$;  $\eta_i\propto(a_i\times d_i)(d_j\times d_k)$",
    ),
    (
        "inverse dynamics",
        "(11)",
        r"$c=(A^T)^+_W(\bar G\ddot q_2+\bar C\dot q_2+\bar Q)+N_{A^T,W}\,c^0,\quad (A^T)^+_W=W^{-1}A(A^TW^{-1}A)^{-1}$",
    ),
    ("Decentralized control", "", ""),
    ("PD", "(12)", r"$c=-K_P(q_a+\Delta q-q_a^d)-K_D(\dot q_a-\dot q_a^d)$"),
    ("rest", "(13), (14)*", r"$A^Tc=0,\quad e_a=-A(A^TK_PA)^{-1}A^TK_P\Delta q,\quad c=-K_P(e_a+\Delta q)$"),
    ("antagonism filter", "(15), (16)", r"$R=(A^T)^+A^T=AA^+,\quad A^TR=A^T,\quad c_\mathrm{eff}=Rc$"),
    (
        "on commands",
        "(17), (18)*",
        r"$e_\mathrm{eff}=R_{A^TK_P}\tilde e_a,\quad q_\mathrm{eff}^d=\tilde q_a-e_\mathrm{eff}$",
    ),
    ("heat removed", "", r"$(R_\mathrm{el}/k_t^2)\int\Vert c-Rc\Vert^2\,dt$, summed over equal drives"),
    ("Model-based control, minimal coordinates", "", ""),
    ("APD", "(19)", r"$c=(A^T)^+(\bar G\ddot q_2^d+\bar C\dot q_2^d+\bar Q-K_D\dot e_2-K_Pe_2)$"),
    ("CTC", "(20)", r"$c=(A^T)^+(\bar Gv_2+\bar C\dot q_2+\bar Q),\quad v_2=\ddot q_2^d-K_D\dot e_2-K_Pe_2$"),
    ("Redundant coordinates", "", ""),
    ("projector", "*", r"$N_J=I-J^+J,\quad \dot N_J=-(J^+\dot JN_J)-(J^+\dot JN_J)^T$; $\tilde A$: its driven rows"),
    (
        "motion equations",
        "(23), (24)",
        r"$\tilde G\ddot q+\tilde C\dot q+\tilde Q=\tilde A^Tc;"
        r"\quad \tilde G=N_JGN_J,\ \tilde C=N_J(CN_J+G\dot N_J),\ \tilde Q=N_JQ$",
    ),
    ("inverse dynamics", "(25)", r"$c=(\tilde A^T)^+N_J(G\ddot q+C\dot q+Q)$"),
    (
        "pseudoinverse",
        "(26), (27)",
        r"$\tilde A=(\tilde A_1;\tilde A_2),\quad B=(\tilde A_1^T)^+\tilde A_2^T,"
        r"\quad (\tilde A_1^T)^+=(\tilde A_1\tilde A_1^T)^{-1}\tilde A_1$",
    ),
    ("", "", r"lower rows $(I+B^TB)^{-1}B^T(\tilde A_1^T)^+$, upper rows $(\tilde A_1^T)^+-B\cdot$(lower rows)"),
    (
        "APD",
        "(28)*, (29)",
        r"$c=(\tilde A^T)^+(\tilde G\ddot q^d+\tilde C\dot q^d+\tilde Q-K_Pe-K_D\dot e),"
        r"\quad K=\mathrm{diag}(K_1,\ldots,K_m,0,\ldots,0)$",
    ),
    (
        "Lyapunov function",
        "(31)",
        r"$\mathcal{V}=\frac{1}{2}\dot e^T\tilde G\dot e+\frac{1}{2}e^TK_Pe+\frac{1}{2}\varepsilon\,e^T\tilde G\dot e$",
    ),
    ("CTC", "(32)*", r"$c=(\tilde A^T)^+(\tilde Gv+\tilde C\dot q+\tilde Q),\quad v=\ddot q^d-K_Pe-K_D\dot e$"),
    ("its errors", "(35)*", r"$\ddot e_2+(F^TF)^{-1}F^TK_DF\dot e_2+(F^TF)^{-1}F^TK_PFe_2=0$"),
]


def sheet() -> Figure:
    """The page."""
    fig = Figure(figsize=(8.27, 11.69))
    FigureCanvasAgg(fig)
    fig.text(0.06, 0.96, "Parallel machines with more drives than needed", size=15, weight="bold", color="#004488")
    fig.text(
        0.06,
        0.942,
        "Formula sheet. SI units; joint order: driven, then passive. * corrected against the print.",
        size=8.5,
    )
    step = 0.9 / (len(ROWS) + 1)
    for k, (what, number, formula) in enumerate(ROWS):
        y = 0.92 - step * k
        if not formula:
            fig.text(0.06, y, what, size=10.5, weight="bold", color="#004488", va="center")
            continue
        if what:
            fig.text(0.06, y, what, size=8.5, va="center")
        if number:
            fig.text(0.22, y, number, size=8.5, va="center", color="#555555")
        fig.text(0.315, y, formula, size=9.5, va="center", math_fontfamily="cm")
    return fig


def main(target: str = "formula_sheet.pdf") -> int:
    """Write the page; 2 where it cannot be written."""
    path = Path(target)
    try:
        sheet().savefig(path, format="pdf", metadata={"Title": "Formula sheet", "CreationDate": None})
    except OSError as error:
        print(f"target = {target!r} ({error.strerror}); allowed: a file in a folder that exists", file=sys.stderr)
        return 2
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")
    return 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", nargs="?", default="formula_sheet.pdf", help="file to write (formula_sheet.pdf)")
    sys.exit(main(**vars(parser.parse_args())))
