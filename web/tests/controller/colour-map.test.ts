import { describe, expect, test } from 'vitest'
import { diverging, gradient } from '../../src/controller/colour-map'

const SURFACE = { light: [255, 255, 255], dark: [26, 33, 37] } as const

/** Contrast ratio of two colours (WCAG). */
function contrast(a: readonly number[], b: readonly number[]): number {
  const luminance = (c: readonly number[]) => {
    const [r, g, b] = c.map((v) => {
      const share = v / 255
      return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4
    })
    return 0.2126 * r + 0.7152 * g + 0.0722 * b
  }
  const [x, y] = [luminance(a), luminance(b)].sort((p, q) => q - p)
  return (x + 0.05) / (y + 0.05)
}

describe.each(['light', 'dark'] as const)('in %s colours', (theme) => {
  test("zero is close to the page's surface, and both ends contrast with it", () => {
    expect(contrast(diverging(0, theme), SURFACE[theme])).toBeLessThan(1.2)
    expect(contrast(diverging(-1, theme), SURFACE[theme])).toBeGreaterThan(4.5)
    expect(contrast(diverging(1, theme), SURFACE[theme])).toBeGreaterThan(4.5)
  })

  test('contrast with zero increases monotonically on both sides', () => {
    for (const side of [-1, 1]) {
      const steps = Array.from({ length: 11 }, (_, k) =>
        contrast(diverging((side * k) / 10, theme), diverging(0, theme)),
      )
      expect([...steps].sort((a, b) => a - b)).toEqual(steps)
    }
  })

  test('negative and positive values differ in blue, visible with common colour blindness', () => {
    expect(diverging(-1, theme)[2] - diverging(1, theme)[2]).toBeGreaterThan(100)
  })

  test('values beyond the ends have the colours of the ends', () => {
    expect(diverging(7, theme)).toEqual(diverging(1, theme))
    expect(diverging(-7, theme)).toEqual(diverging(-1, theme))
  })
})

test('the legend spans the whole range', () => {
  expect(gradient('light')).toMatch(/^linear-gradient\(to right, #0e498c, .*, #ad4904\)$/)
})
