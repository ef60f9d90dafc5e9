/** Bounds and meaning of priorities. */

export const LOWEST = -10
export const HIGHEST = 10

export const PRIORITY_HELP =
  'Queued jobs start in order of priority. Among running jobs, each step doubles the share of the' +
  ' workers. Results do not depend on it.'

export const PRIORITY_ERROR = `must be an integer from ${LOWEST} to ${HIGHEST}`

/** Whether a text is a valid priority. */
export function isPriority(text: string): boolean {
  const priority = Number(text)
  const whole = text.trim() !== '' && Number.isInteger(priority)
  return whole && LOWEST <= priority && priority <= HIGHEST
}
