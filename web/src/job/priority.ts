/** Priorities of jobs: their bounds, and what they do. */

export const LOWEST = -10
export const HIGHEST = 10

export const PRIORITY_HELP =
  'Of waiting jobs the highest is run first, and of running jobs one that is a step higher has' +
  ' twice the share of the workers. No result depends on it.'

/** Whether a text is a priority. */
export function isPriority(text: string): boolean {
  const priority = Number(text)
  const whole = text.trim() !== '' && Number.isInteger(priority)
  return whole && LOWEST <= priority && priority <= HIGHEST
}
