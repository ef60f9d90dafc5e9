/** The part of CanvasRenderingContext2D that charts use, writing SVG. */

import { element, paint, short } from './svg-text'

type Matrix = readonly [number, number, number, number, number, number]

const STATE = [
  'fillStyle',
  'strokeStyle',
  'lineWidth',
  'globalAlpha',
  'font',
  'textAlign',
  'textBaseline',
  'lineJoin',
] as const

interface SavedState {
  readonly values: Readonly<Record<string, unknown>>
  readonly matrix: Matrix
  readonly dash: readonly number[]
  readonly clipped: string | null
}

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
  /** Elements drawn so far. */
  readonly parts: string[] = []
  private path = ''
  private matrix: Matrix = [1, 0, 0, 1, 0, 0]
  private dash: readonly number[] = []
  private clipped: string | null = null
  private readonly saved: SavedState[] = []

  constructor(
    /** Size of the canvas [CSS px]. */
    readonly canvas: { readonly width: number; readonly height: number },
    private readonly ruler: Pick<CanvasRenderingContext2D, 'font' | 'measureText'>,
  ) {}

  save(): void {
    const values = Object.fromEntries(STATE.map((key) => [key, this[key]]))
    this.saved.push({ values, matrix: this.matrix, dash: this.dash, clipped: this.clipped })
  }

  restore(): void {
    const saved = this.saved.pop()
    if (!saved) return
    Object.assign(this, saved.values)
    this.matrix = saved.matrix
    this.dash = saved.dash
    this.clipped = saved.clipped
  }

  translate(x: number, y: number): void {
    this.transform([1, 0, 0, 1, x, y])
  }

  scale(x: number, y: number): void {
    this.transform([x, 0, 0, y, 0, 0])
  }

  rotate(angle: number): void {
    const [c, s] = [Math.cos(angle), Math.sin(angle)]
    this.transform([c, s, -s, c, 0, 0])
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
    const corners = [this.at(x, y), this.at(x + width, y), this.at(x + width, y + height)]
    this.path += `M${[...corners, this.at(x, y + height)].join('L')}Z`
  }

  /** Full circles, the only arcs that charts draw. */
  arc(x: number, y: number, radius: number): void {
    const r = short(radius * this.size)
    const [left, right] = [this.at(x - radius, y), this.at(x + radius, y)]
    this.path += `M${left}A${r} ${r} 0 1 1 ${right}A${r} ${r} 0 1 1 ${left}Z`
  }

  fill(): void {
    this.add(element('path', { d: this.path, ...paint('fill', this.fillStyle, this.globalAlpha) }))
  }

  stroke(): void {
    this.add(element('path', { d: this.path, fill: 'none', ...this.pen() }))
  }

  clip(): void {
    const id = `clip-${++clips}`
    this.parts.push(element('clipPath', { id }, element('path', { d: this.path })))
    this.clipped = id
  }

  fillRect(x: number, y: number, width: number, height: number): void {
    const before = this.path
    this.path = ''
    this.rect(x, y, width, height)
    this.fill()
    this.path = before
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

  private text(text: string, x: number, y: number, colours: Readonly<Record<string, unknown>>) {
    const [, weight, size, family] = /^(?:(\d+|bold) )?([\d.]+)px (.*)$/.exec(this.font) ?? []
    const { fontBoundingBoxAscent: up, fontBoundingBoxDescent: down } = this.measureText(text)
    const shifts: Readonly<Record<string, number>> = {
      top: up,
      middle: (up - down) / 2,
      bottom: -down,
    }
    const shift = shifts[this.textBaseline] ?? 0
    const attributes = {
      x,
      y: y + shift,
      transform: `matrix(${this.matrix.map(short).join(' ')})`,
      'font-family': family,
      'font-size': size,
      'font-weight': weight,
      'text-anchor': ANCHORS[this.textAlign],
      ...colours,
    }
    this.add(
      element('text', attributes as never, text.replaceAll('&', '&amp;').replaceAll('<', '&lt;')),
    )
  }

  private pen() {
    return {
      ...paint('stroke', this.strokeStyle, this.globalAlpha),
      'stroke-width': this.lineWidth * this.size,
      'stroke-dasharray': this.dash.map((length) => short(length * this.size)).join(' ') || null,
      'stroke-linejoin': this.lineJoin === 'miter' ? null : this.lineJoin,
    }
  }

  private add(part: string): void {
    this.parts.push(
      this.clipped ? element('g', { 'clip-path': `url(#${this.clipped})` }, part) : part,
    )
  }

  private at(x: number, y: number): string {
    const [a, b, c, d, e, f] = this.matrix
    return `${short(a * x + c * y + e)} ${short(b * x + d * y + f)}`
  }

  /** Scale factor of lengths. */
  private get size(): number {
    return Math.hypot(this.matrix[0], this.matrix[1])
  }

  private transform([a, b, c, d, e, f]: Matrix): void {
    const [A, B, C, D, E, F] = this.matrix
    this.matrix = [
      A * a + C * b,
      B * a + D * b,
      A * c + C * d,
      B * c + D * d,
      A * e + C * f + E,
      B * e + D * f + F,
    ]
  }
}
