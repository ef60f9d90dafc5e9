/** Names of the API in words for people. */

/** `angular_acceleration` -> `angular acceleration`. */
export function inWords(name: string): string {
  return name.replaceAll('_', ' ')
}
