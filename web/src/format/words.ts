/** Names of the API in words for people. */

/** `angular_acceleration` -> `angular acceleration`. */
export function inWords(name: string): string {
  return name.replaceAll('_', ' ')
}

/** With a capital at the beginning. */
export function capitalized(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1)
}

/** As a sentence: a capital at the beginning, a stop at the end. */
export function sentence(text: string): string {
  const whole = capitalized(text.trim())
  return whole === '' || /[.!?…]$/.test(whole) ? whole : `${whole}.`
}
