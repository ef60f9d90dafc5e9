import { describe, expect, test } from 'vitest'
import { csvOf, fileStem } from '../../src/export/csv'
import { element, paint, SvgContext } from '../../src/export/svg'
import { decodeParticles, particlesTable } from '../../src/job/designs/particles'

describe('comma-separated values', () => {
  test('keep full precision, quote where necessary, and leave missing values empty', () => {
    const rows = [
      [0.1 + 0.2, 'say "yes", or no', null],
      [Number.NaN, 'plain', -1e-12],
    ]
    expect(csvOf({ name: 'any', header: ['a [m]', 'b', 'c'], rows })).toBe(
      'a [m],b,c\r\n0.30000000000000004,"say ""yes"", or no",\r\n,plain,-1e-12\r\n',
    )
  })

  test('files are named after job and chart', () => {
    expect(fileStem('Gänge: Lauf #3', 'Pareto front')).toBe('ga-nge-lauf-3-pareto-front')
    expect(fileStem('/', '')).toBe('chart')
  })
})

test('exported designs have full precision, and choices by name', () => {
  const header = JSON.stringify({
    rows: 2,
    total: 2,
    columns: [
      { name: 'x', unit: 's', low: 0, high: 1, kind: 'continuous', choices: [] },
      { name: 'kind', unit: '1', low: null, high: null, kind: 'categorical', choices: ['a', 'b'] },
    ],
  }).padEnd(400)
  const buffer = new ArrayBuffer(4 + header.length + 16)
  new DataView(buffer).setUint32(0, header.length, true)
  new Uint8Array(buffer, 4).set(new TextEncoder().encode(header))
  new Float32Array(buffer, 4 + header.length).set([0.1, Number.NaN, 1, 0])
  const table = particlesTable(decodeParticles(buffer), [1, 0])
  expect(csvOf(table)).toBe('x [s],kind\r\n,a\r\n0.1,b\r\n')
})

describe('an SVG drawing', () => {
  const ruler = {
    font: '',
    measureText: () => ({ fontBoundingBoxAscent: 8, fontBoundingBoxDescent: 2, width: 5 }) as never,
  }

  test('has transformed lines and rectangles', () => {
    const context = new SvgContext(ruler)
    context.save()
    context.translate(5, 0)
    context.scale(2, 2)
    context.strokeStyle = 'rgba(1, 2, 3, 0.5)'
    context.lineWidth = 3
    context.beginPath()
    context.moveTo(1, 1)
    context.lineTo(2, 3)
    context.stroke()
    context.restore()
    context.fillStyle = 'rgb(9, 9, 9)'
    context.fillRect(0, 0, 1, 1)
    expect(context.parts).toEqual([
      '<path d="M7 2L9 6" fill="none" stroke="rgb(1,2,3)" stroke-opacity="0.5" stroke-width="6"/>',
      '<path d="M0 0L1 0L1 1L0 1Z" fill="rgb(9,9,9)"/>',
    ])
  })

  test('has escaped text', () => {
    const context = new SvgContext(ruler)
    context.font = '600 12px serif'
    context.fillText('a < b & c', 1, 1)
    expect(context.parts[0]).toContain('font-weight="600"')
    expect(context.parts[0]).toContain('>a &lt; b &amp; c</text>')
    expect(element('g', { id: '"' })).toBe('<g id="&quot;"/>')
    expect(paint('fill', 'rgb(1 2 3 / 0.5)', 0.5)).toEqual({
      fill: 'rgb(1,2,3)',
      'fill-opacity': 0.25,
    })
  })
})
