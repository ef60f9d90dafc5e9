/** What tab, history and bookmarks call the page. */

let name = ''

export function setTitle(...parts: readonly string[]): void {
  name = parts[0] ?? ''
  document.title = [...parts, 'gaitswarm'].join(' · ')
}

/** What the page is about, such as a job's name; files that are saved are called by it. */
export function pageName(): string {
  return name
}
