"""What a page must keep in any window: nothing clipped, nothing too small, nothing too faint."""

from __future__ import annotations

from browser import Browser

SMALLEST_PX = 9.0
SHEET_PX = 717  # of A4 between Chromium's margins, at 96 to the inch
LEAST_CONTRAST = 4.5  # WCAG 2.1 AA for text

CLIPPED = """
[...document.querySelectorAll('table, h1, h2, h3, p, pre, figure, svg')].filter(e => {
  const box = e.getBoundingClientRect();
  if (!box.width || e.closest('.live') || e.closest('.scroll')) return false;
  return box.right > innerWidth + 1 || box.left < -1;
}).map(e => e.tagName + ': ' + e.textContent.slice(0, 60))
"""

STACKED_PX = 36  # a column of letters: no word of six stands in it
STACKED = """
[...document.querySelectorAll('th, td')].filter(e =>
  e.checkVisibility() && e.clientWidth && e.clientWidth < LEAST && e.textContent.trim().length > 5
).map(e => e.textContent.slice(0, 40))
"""

SMALL = """
(() => {
  const found = [], walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const node = walk.currentNode, e = node.parentElement;
    if (!node.textContent.trim() || ['SCRIPT', 'STYLE'].includes(e.tagName)) continue;
    const box = e.getBoundingClientRect();
    if (!box.width || !e.checkVisibility()) continue;
    let size = parseFloat(getComputedStyle(e).fontSize);
    if (e.ownerSVGElement) size *= e.ownerSVGElement.getScreenCTM().a;
    if (size < LEAST) found.push(size + ': ' + node.textContent.slice(0, 40));
  }
  for (const u of document.querySelectorAll('canvas')) {
    const drawnAt = u.getContext('2d').font.match(/([0-9.]+)px/);
    if (drawnAt && parseFloat(drawnAt[1]) / devicePixelRatio < LEAST) found.push('canvas ' + drawnAt[0]);
  }
  return found;
})()
"""

FAINT = """
(() => {
  const parts = (text) => {
    const all = text.match(/[0-9.]+/g).map(Number);
    // A mixed colour comes back as color(srgb 0.9 0.9 1), not as rgb(230, 230, 255).
    const m = text.startsWith('color(') ? all.map((v, k) => k < 3 ? 255 * v : v) : all;
    return m.length < 4 ? [...m.slice(0, 3), 1] : m;
  };
  const linear = (v) => v / 255 <= .03928 ? v / 255 / 12.92 : ((v / 255 + .055) / 1.055) ** 2.4;
  const shade = ([r, g, b]) => .2126 * linear(r) + .7152 * linear(g) + .0722 * linear(b);
  const ground = (e) => {
    for (; e; e = e.parentElement) {
      const c = parts(getComputedStyle(e).backgroundColor);
      if (c[3] > .99) return c;
    }
    return [255, 255, 255, 1];
  };
  const found = [], walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const node = walk.currentNode, e = node.parentElement;
    if (!node.textContent.trim() || ['SCRIPT', 'STYLE'].includes(e.tagName)) continue;
    if (e.ownerSVGElement || !e.checkVisibility()) continue;
    const a = shade(parts(getComputedStyle(e).color)), b = shade(ground(e));
    const contrast = (Math.max(a, b) + .05) / (Math.min(a, b) + .05);
    if (contrast < LEAST) found.push(contrast.toFixed(2) + ': ' + node.textContent.slice(0, 40));
  }
  return found;
})()
"""


def look(browser: Browser) -> list[str]:
    """What is wrong with the page that is open, in words."""
    found = browser.faults()
    wide = browser.run("document.documentElement.scrollWidth - innerWidth")
    if wide > 0:
        found.append(f"the page is {wide} px wider than the window")
    found += [f"clipped: {text}" for text in browser.run(CLIPPED)]
    found += [f"a column of letters: {text}" for text in browser.run(STACKED.replace("LEAST", str(STACKED_PX)))]
    found += [f"too small: {text}" for text in browser.run(SMALL.replace("LEAST", str(SMALLEST_PX)))]
    found += [f"too faint: {text}" for text in browser.run(FAINT.replace("LEAST", str(LEAST_CONTRAST)))]
    return found


OFF_PAPER = """
[...document.querySelectorAll('table, h1, h2, h3, p, pre, figure, svg')].filter(e => {
  const box = e.getBoundingClientRect();
  return box.width && !e.closest('.live') && (box.right > innerWidth + 1 || box.left < -1);
}).map(e => e.tagName + ': ' + e.textContent.slice(0, 60))
"""


def look_of_paper(browser: Browser) -> list[str]:
    """What would stand beside an A4 sheet, in words: nothing scrolls there."""
    browser.call("Emulation.setEmulatedMedia", media="print")
    browser.call("Emulation.setDeviceMetricsOverride", width=SHEET_PX, height=1000, deviceScaleFactor=1, mobile=False)
    browser.run("dispatchEvent(new Event('beforeprint'))")
    browser.settle()
    found = [f"beside the sheet: {text}" for text in browser.run(OFF_PAPER)]
    browser.run("dispatchEvent(new Event('afterprint'))")
    browser.call("Emulation.setEmulatedMedia", media="")
    return found


def unfold(browser: Browser) -> None:
    """Open every folded part, bring each chart into sight and wait until it is drawn."""
    browser.run("document.querySelectorAll('details').forEach(d => d.open = true)")
    browser.settle()
    count = browser.run("document.querySelectorAll('figure.chart').length")
    for number in range(count):
        browser.run(f"document.querySelectorAll('figure.chart')[{number}].scrollIntoView()")
        browser.settle()
