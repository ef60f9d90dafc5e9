/** A card as an SVG picture: text, bars and legends in their positions, charts as vectors. */

import { sourceOf } from '../charts/canvas'
import { themeColour } from '../theme'
import { element, escaped, paint, SvgContext } from './svg'

/** An SVG and its size [CSS px]. */
interface Picture {
  readonly svg: string
  readonly width: number
  readonly height: number
}

/** Excluded: controls except column headers, text for screen readers only, pointer readouts. */
const LEFT_OUT =
  '[data-not-drawn], .visually-hidden, button:not(th > button), select, input, details, .readout, .u-select, [class*="u-cursor"]'

const COPIED = 'fill fill-opacity stroke stroke-width stroke-dasharray vector-effect opacity'.split(
  ' ',
)

const ROOM = 12

export function pictureOf(card: HTMLElement): Picture {
  const scrolled = [...card.querySelectorAll('.parallel-scroll')].map(
    (box) => [box, box.scrollLeft] as const,
  )
  for (const [box] of scrolled) box.scrollLeft = 0
  const writer = new Writer(card.getBoundingClientRect())
  for (const child of card.childNodes) writer.node(child)
  for (const [box, left] of scrolled) box.scrollLeft = left
  return writer.picture()
}

class Writer {
  private readonly parts: string[] = []
  private readonly ruler = document.createElement('canvas').getContext('2d')!
  private right = 0
  private bottom = 0

  constructor(private readonly frame: DOMRect) {
    this.right = frame.width
  }

  picture(): Picture {
    const [width, height] = [Math.ceil(this.right), Math.ceil(this.bottom + ROOM)]
    const ground = element('rect', { width, height, ...paint('fill', themeColour('--surface')) })
    const svg = element(
      'svg',
      { xmlns: 'http://www.w3.org/2000/svg', width, height, viewBox: `0 0 ${width} ${height}` },
      `${ground}${this.parts.join('\n')}`,
    )
    return { svg, width, height }
  }

  node(node: Node): void {
    if (node instanceof Text) this.text(node)
    else if (node instanceof Element && !node.matches(LEFT_OUT)) this.element(node)
  }

  private element(node: Element): void {
    const style = getComputedStyle(node)
    if (style.display === 'none' || style.visibility === 'hidden' || style.opacity === '0') return
    const box = this.boxOf(node.getBoundingClientRect())
    if (node instanceof HTMLCanvasElement) this.canvas(node, box)
    else if (node instanceof SVGSVGElement) this.drawing(node, box)
    else {
      if (box.width > 0 && box.height > 0) this.ground(style, box)
      this.borders(style, box)
      for (const child of node.childNodes) this.node(child)
    }
  }

  private boxOf({ left, top, width, height }: DOMRect) {
    const box = { x: left - this.frame.left, y: top - this.frame.top, width, height }
    if (width > 0 && height > 0) {
      this.right = Math.max(this.right, box.x + width + ROOM)
      this.bottom = Math.max(this.bottom, box.y + height)
    }
    return box
  }

  private ground(
    { backgroundColor, backgroundImage, borderRadius }: CSSStyleDeclaration,
    box: Box,
  ) {
    const rx = Math.min(Number.parseFloat(borderRadius) || 0, box.height / 2) || null
    const colours = backgroundImage.match(/rgba?\([^)]*\)/g)
    if (colours && backgroundImage.startsWith('linear-gradient')) {
      const id = `ground-${this.parts.length}`
      const stops = colours.map((colour, k) =>
        element('stop', { offset: k / (colours.length - 1), 'stop-color': colour }),
      )
      this.parts.push(element('linearGradient', { id }, stops.join('')))
      this.parts.push(element('rect', { ...box, rx, fill: `url(#${id})` }))
    } else if (isSeen(backgroundColor)) {
      this.parts.push(element('rect', { ...box, rx, ...paint('fill', backgroundColor) }))
    }
  }

  private borders(style: CSSStyleDeclaration, { x, y, width, height }: Box): void {
    const sides = [
      ['Top', x, y, x + width, y],
      ['Right', x + width, y, x + width, y + height],
      ['Bottom', x, y + height, x + width, y + height],
      ['Left', x, y, x, y + height],
    ] as const
    for (const [side, x1, y1, x2, y2] of sides) {
      const thick = Number.parseFloat(style[`border${side}Width`])
      const kind = style[`border${side}Style`]
      const colour = style[`border${side}Color`]
      if (!(thick > 0) || kind === 'none' || !isSeen(colour)) continue
      const dash = kind === 'dashed' ? '4 3' : kind === 'dotted' ? '1 2' : null
      this.parts.push(
        element('line', {
          ...{ x1, y1, x2, y2, 'stroke-width': thick, 'stroke-dasharray': dash },
          ...paint('stroke', colour),
        }),
      )
    }
  }

  /** Write line by line, as the text is wrapped. */
  private text(node: Text): void {
    const style = node.parentElement && getComputedStyle(node.parentElement)
    if (!style || node.data.trim() === '') return
    const font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`
    this.ruler.font = font
    const { fontBoundingBoxAscent: up, fontBoundingBoxDescent: down } = this.ruler.measureText('x')
    for (const { text, box } of linesOf(node)) {
      const { x, y, height } = this.boxOf(box)
      const attributes = {
        x,
        y: y + (height * up) / (up + down),
        'font-family': style.fontFamily,
        'font-size': style.fontSize,
        'font-weight': style.fontWeight,
        ...paint('fill', style.color),
      }
      this.parts.push(element('text', attributes, escaped(text)))
    }
  }

  private canvas(canvas: HTMLCanvasElement, box: Box): void {
    const { draw, refresh } = sourceOf(canvas)
    if (!draw) {
      refresh?.()
      const href = canvas.toDataURL('image/png')
      this.parts.push(element('image', { ...box, href, preserveAspectRatio: 'none' }))
      return
    }
    const context = new SvgContext(this.ruler)
    draw(context as unknown as CanvasRenderingContext2D)
    const transform = `translate(${box.x} ${box.y})`
    this.parts.push(element('g', { transform }, context.parts.join('\n')))
  }

  /** Copy an SVG of the page with the colours of its style sheets. */
  private drawing(node: SVGSVGElement, box: Box): void {
    const copy = node.cloneNode(true) as SVGSVGElement
    const copies = copy.querySelectorAll('*')
    for (const [k, part] of node.querySelectorAll('*').entries()) {
      const style = getComputedStyle(part)
      copies[k].removeAttribute('style')
      for (const name of COPIED) copies[k].setAttribute(name, style.getPropertyValue(name))
    }
    for (const [name, value] of Object.entries(box)) copy.setAttribute(name, String(value))
    for (const name of ['class', 'role', 'aria-label']) copy.removeAttribute(name)
    this.parts.push(new XMLSerializer().serializeToString(copy))
  }
}

interface Box {
  readonly x: number
  readonly y: number
  readonly width: number
  readonly height: number
}

function isSeen(colour: string): boolean {
  return colour !== 'transparent' && !/[,/]\s*0\)$/.test(colour)
}

function linesOf(node: Text): readonly { readonly text: string; readonly box: DOMRect }[] {
  const range = document.createRange()
  const lines: { text: string; box: DOMRect }[] = []
  for (const { 0: word, index } of node.data.matchAll(/\S+/g)) {
    range.setStart(node, index)
    range.setEnd(node, index + word.length)
    const box = range.getBoundingClientRect()
    if (box.width === 0) continue
    const line = lines.at(-1)
    if (line && Math.abs(line.box.top - box.top) < 2) {
      line.text += ` ${word}`
      line.box = new DOMRect(line.box.left, line.box.top, box.right - line.box.left, box.height)
    } else lines.push({ text: word, box })
  }
  return lines
}

/** Rasterize at two pixels per CSS pixel. */
export async function pngOf({ svg, width, height }: Picture): Promise<Blob> {
  const address = URL.createObjectURL(new Blob([svg], { type: 'image/svg+xml' }))
  try {
    const image = new Image()
    image.src = address
    await image.decode()
    const canvas = document.createElement('canvas')
    canvas.width = 2 * width
    canvas.height = 2 * height
    canvas.getContext('2d')!.drawImage(image, 0, 0, canvas.width, canvas.height)
    const blob = await new Promise<Blob | null>((done) => canvas.toBlob(done, 'image/png'))
    if (!blob) throw new Error('The browser cannot create a PNG of this size; use SVG instead.')
    return blob
  } finally {
    URL.revokeObjectURL(address)
  }
}
