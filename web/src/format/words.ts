/** Text formatting of API names and messages. */

/** `angular_acceleration` -> `angular acceleration`. */
export function inWords(name: string): string {
  return name.replaceAll('_', ' ')
}

export function capitalized(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1)
}

export function sentence(text: string): string {
  const whole = capitalized(text.trim())
  return whole === '' || /[.!?…]$/.test(whole) ? whole : `${whole}.`
}
