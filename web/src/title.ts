/** Document title. */

let name = ''

export function setTitle(...parts: readonly string[]): void {
  name = parts[0] ?? ''
  document.title = [...parts, 'gaitswarm'].join(' · ')
}

/** First part of the title, such as a job's name; saved files are named after it. */
export function pageName(): string {
  return name
}
