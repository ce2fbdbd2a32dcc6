"""report.html: a self-contained HTML page for each kind of result.

`build.write_page` makes a page from rows, sections and pictures. The modules named like commands fill it from a results
folder alone, so that a page can be written again at any time::

    write_page(
        folder,
        "mu from strain",
        headline=[HeadlineRow("resolution of mu", 0.012, error=0.002)],
        sections=[PageSection("Fit", ["second order", Table(head, rows)])],
        figures=[Figure("fit.png", "...")],
        command="calibrate",
    )
"""
