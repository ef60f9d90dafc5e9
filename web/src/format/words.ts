/** Text formatting of API names and messages. */

/** `angular_acceleration` -> `angular acceleration`; the reciprocal speed has a name of its own. */
export function inWords(name: string): string {
  return name.replaceAll('reciprocal_speed', 'time per metre').replaceAll('_', ' ')
}

export function capitalized(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1)
}

export function sentence(text: string): string {
  const whole = capitalized(text.trim())
  return whole === '' || /[.!?…]$/.test(whole) ? whole : `${whole}.`
}
