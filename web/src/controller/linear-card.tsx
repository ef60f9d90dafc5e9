/** Control law and gains of a linear controller. */

import { formatExactValue } from '../format/value'
import type { ResolvedDesign } from '../walk/design/resolve-design'

interface Term {
  readonly gain: string
  readonly text: string
  readonly meaning: string
}

/** Terms of the control law, by gain. */
const TERMS: readonly Term[] = [
  { gain: 'P', text: 'error', meaning: 'responds immediately, in proportion to the angle error' },
  {
    gain: 'I',
    text: '∫ error dt',
    meaning: 'grows as long as an error persists, and thus removes it',
  },
  {
    gain: 'D',
    text: 'd error / dt',
    meaning: 'responds to the rate of change of the error, and thus damps',
  },
]

/** Whether a controller has only gains, and hence no fuzzy surface. */
export function isLinear({ controller }: ResolvedDesign): boolean {
  return controller.variables.every(({ name }) => TERMS.some(({ gain }) => gain === name))
}

export function LinearCard({ design }: { design: ResolvedDesign }) {
  const terms = TERMS.filter(({ gain }) => gain in design.design)
  return (
    <section class="card" data-linear={design.controller.name}>
      <header>
        <h2>Control law</h2>
        <p class="muted small">
          This controller is linear: it has no rules, hence no fuzzy surface and no table. Its
          output does not depend on the motor current.
        </p>
      </header>
      <p class="law">
        PWM ={' '}
        {terms.map(({ gain, text }, k) => (
          <span key={gain}>
            {k > 0 && ' + '}
            <b>{formatExactValue(design.design[gain])}</b> · {text}
          </span>
        ))}
      </p>
      <ul>
        {terms.map(({ gain, meaning }) => (
          <li key={gain}>
            <b>{gain}</b> = {formatExactValue(design.design[gain])}{' '}
            <span class="unit">
              {design.controller.variables.find(({ name }) => name === gain)?.unit}
            </span>
            : {meaning}.
          </li>
        ))}
      </ul>
      <p class="muted">
        To see a surface, choose a fuzzy design above, for example{' '}
        <a href="/controller?controller=fuzzy-pi&published=A">the published optimum A</a>.
      </p>
    </section>
  )
}
