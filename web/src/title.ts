/** What tab, history and bookmarks call the page. */

export function setTitle(...parts: readonly string[]): void {
  document.title = [...parts, 'gaitswarm'].join(' · ')
}
