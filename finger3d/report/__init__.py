"""report.html: one file that tells a result, with nothing fetched from anywhere; and steps.npz behind its 3D view.

`write_page` builds a page from rows, sections and pictures; `press_page` and `compare_page` fill it from a results
folder, so that a page can be made again at any time::

    write_page(folder, "mu from strain", command="calibrate", headline=[Row("resolution of mu", 0.012, "", 0.002)],
               sections=[Section("Fit", ["second order", Table(head, rows)])], figures=[Figure("fit.png", "...")])
"""
