/** Text formatting of API names and messages. */

/** `angular_acceleration` -> `angular acceleration`. */
export function inWords(name: string): string {
  return name.replaceAll('_', ' ')
}

/** Capitalize the first letter. */
export function capitalized(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1)
}

/** Capitalize, and end with a full stop. */
export function sentence(text: string): string {
  const whole = capitalized(text.trim())
  return whole === '' || /[.!?…]$/.test(whole) ? whole : `${whole}.`
}
