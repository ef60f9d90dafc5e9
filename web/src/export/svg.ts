/** SVG elements as text, and the part of CanvasRenderingContext2D that charts use, writing them. */

type Attributes = Readonly<Record<string, string | number | null | undefined>>

/** `<name a="1">content</name>`; attributes without a value are omitted. */
export function element(name: string, attributes: Attributes, content = ''): string {
  const written = Object.entries(attributes)
    .filter(([, value]) => value !== null && value !== undefined)
    .map(
      ([key, value]) => ` ${key}="${typeof value === 'number' ? short(value) : escaped(value!)}"`,
    )
  return `<${name}${written.join('')}${content === '' ? '/>' : `>${content}</${name}>`}`
}

export function escaped(text: string): string {
  const entities: Readonly<Record<string, string>> = {
    '&': '&amp;',
    '<': '&lt;',
    '>': '&gt;',
    '"': '&quot;',
  }
  return text.replace(/[&<>"]/g, (character) => entities[character])
}

function short(value: number): string {
  return String(Math.round(value * 100) / 100)
}

/** `fill` or `stroke` with a separate opacity, since some programs cannot read `rgba()`. */
export function paint(kind: 'fill' | 'stroke', colour: string, opacity = 1): Attributes {
  const [red, green, blue, alpha = 1] = (colour.match(/[\d.]+/g) ?? []).map(Number)
  const isRgb = colour.startsWith('rgb')
  const share = isRgb ? alpha * opacity : opacity
  return {
    [kind]: isRgb ? `rgb(${red},${green},${blue})` : colour,
    [`${kind}-opacity`]: share < 1 ? share : null,
  }
}

type Matrix = readonly [number, number, number, number, number, number]

const ANCHORS: Readonly<Record<string, string>> = { center: 'middle', right: 'end', end: 'end' }

let clips = 0

export class SvgContext {
  fillStyle = '#000'
  strokeStyle = '#000'
  lineWidth = 1
  globalAlpha = 1
  font = '10px sans-serif'
  textAlign = 'left'
  textBaseline = 'alphabetic'
  lineJoin = 'miter'
  readonly parts: string[] = []
  private path = ''
  private matrix: Matrix = [1, 0, 0, 1, 0, 0]
  private dash: readonly number[] = []
  private clipPath: string | null = null
  private readonly saved: object[] = []

  constructor(private readonly ruler: Pick<CanvasRenderingContext2D, 'font' | 'measureText'>) {}

  save(): void {
    this.saved.push({ ...this })
  }

  restore(): void {
    Object.assign(this, this.saved.pop())
  }

  translate(x: number, y: number): void {
    this.transform(1, 0, 0, 1, x, y)
  }

  scale(x: number, y: number): void {
    this.transform(x, 0, 0, y, 0, 0)
  }

  rotate(angle: number): void {
    const [c, s] = [Math.cos(angle), Math.sin(angle)]
    this.transform(c, s, -s, c, 0, 0)
  }

  private transform(a: number, b: number, c: number, d: number, e: number, f: number): void {
    const [A, B, C, D, E, F] = this.matrix
    const linear = [A * a + C * b, B * a + D * b, A * c + C * d, B * c + D * d] as const
    this.matrix = [...linear, A * e + C * f + E, B * e + D * f + F]
  }

  setLineDash(dash: readonly number[]): void {
    this.dash = dash
  }

  beginPath(): void {
    this.path = ''
  }

  moveTo(x: number, y: number): void {
    this.path += `M${this.at(x, y)}`
  }

  lineTo(x: number, y: number): void {
    this.path += `L${this.at(x, y)}`
  }

  closePath(): void {
    this.path += 'Z'
  }

  rect(x: number, y: number, width: number, height: number): void {
    this.moveTo(x, y)
    this.lineTo(x + width, y)
    this.lineTo(x + width, y + height)
    this.lineTo(x, y + height)
    this.closePath()
  }

  /** Full circles, the only arcs that charts draw. */
  arc(x: number, y: number, radius: number): void {
    const r = short(radius * this.size)
    const [left, right] = [this.at(x - radius, y), this.at(x + radius, y)]
    this.path += `M${left}A${r} ${r} 0 1 1 ${right}A${r} ${r} 0 1 1 ${left}Z`
  }

  fill(): void {
    this.add('path', { d: this.path, ...paint('fill', this.fillStyle, this.globalAlpha) })
  }

  stroke(): void {
    this.add('path', { d: this.path, fill: 'none', ...this.pen() })
  }

  clip(): void {
    const id = `clip-${++clips}`
    this.parts.push(element('clipPath', { id }, element('path', { d: this.path })))
    this.clipPath = `url(#${id})`
  }

  fillRect(x: number, y: number, width: number, height: number): void {
    this.beginPath()
    this.rect(x, y, width, height)
    this.fill()
  }

  fillText(text: string, x: number, y: number): void {
    this.text(text, x, y, paint('fill', this.fillStyle, this.globalAlpha))
  }

  strokeText(text: string, x: number, y: number): void {
    this.text(text, x, y, { fill: 'none', ...this.pen() })
  }

  measureText(text: string): TextMetrics {
    this.ruler.font = this.font
    return this.ruler.measureText(text)
  }

  private text(text: string, x: number, y: number, colours: Attributes): void {
    const [, weight, size, family] = /^(?:(\d+|bold) )?([\d.]+)px (.*)$/.exec(this.font) ?? []
    const { fontBoundingBoxAscent: up, fontBoundingBoxDescent: down } = this.measureText(text)
    // Editors position text by its baseline only.
    const shifts: Readonly<Record<string, number>> = {
      top: up,
      middle: (up - down) / 2,
      bottom: -down,
    }
    const attributes = {
      x,
      y: y + (shifts[this.textBaseline] ?? 0),
      transform: `matrix(${this.matrix.map(short).join(' ')})`,
      'font-family': family,
      'font-size': size,
      'font-weight': weight,
      'text-anchor': ANCHORS[this.textAlign],
      ...colours,
    }
    this.add('text', attributes, escaped(text))
  }

  private pen(): Attributes {
    return {
      ...paint('stroke', this.strokeStyle, this.globalAlpha),
      'stroke-width': this.lineWidth * this.size,
      'stroke-dasharray': this.dash.map((length) => short(length * this.size)).join(' ') || null,
      'stroke-linejoin': this.lineJoin === 'miter' ? null : this.lineJoin,
    }
  }

  private add(name: string, attributes: Attributes, content = ''): void {
    const part = element(name, attributes, content)
    this.parts.push(this.clipPath ? element('g', { 'clip-path': this.clipPath }, part) : part)
  }

  private at(x: number, y: number): string {
    const [a, b, c, d, e, f] = this.matrix
    return `${short(a * x + c * y + e)} ${short(b * x + d * y + f)}`
  }

  private get size(): number {
    return Math.hypot(this.matrix[0], this.matrix[1])
  }
}
