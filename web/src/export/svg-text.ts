/** SVG elements as text. */

export type Attributes = Readonly<Record<string, string | number | null | undefined>>

/** `<name a="1">content</name>`; attributes without a value are omitted. */
export function element(name: string, attributes: Attributes, content = ''): string {
  const written = Object.entries(attributes)
    .filter(([, value]) => value !== null && value !== undefined)
    .map(
      ([key, value]) => ` ${key}="${escaped(typeof value === 'number' ? short(value) : value!)}"`,
    )
  return content === ''
    ? `<${name}${written.join('')}/>`
    : `<${name}${written.join('')}>${content}</${name}>`
}

export function escaped(text: string): string {
  return text
    .replaceAll('&', '&amp;')
    .replaceAll('<', '&lt;')
    .replaceAll('>', '&gt;')
    .replaceAll('"', '&quot;')
}

/** Round to a hundredth of a pixel. */
export function short(value: number): string {
  return String(Math.round(value * 100) / 100)
}

/** `fill` or `stroke` with a separate opacity, since some programs cannot read `rgba()`. */
export function paint(kind: 'fill' | 'stroke', colour: string, opacity = 1): Attributes {
  const [red, green, blue, alpha = 1] = (colour.match(/[\d.]+/g) ?? []).map(Number)
  if (!colour.startsWith('rgb')) {
    return { [kind]: colour, [`${kind}-opacity`]: opacity < 1 ? opacity : null }
  }
  const share = alpha * opacity
  return {
    [kind]: `rgb(${red},${green},${blue})`,
    [`${kind}-opacity`]: share < 1 ? share : null,
  }
}
