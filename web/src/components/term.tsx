/** Terms whose definition opens next to them. */

import { useId } from 'preact/hooks'

/** As in docs/glossary.md. */
export const GLOSSARY = {
  constraint:
    'A limit on a quantity of a simulation, in one scenario or in all. A design that violates one is infeasible: it has no fitness.',
  fitness:
    "What a search minimizes: the geometric mean of the scenarios' utilities, f_G. Less is better.",
  preference: "How much objectives count: bias and exponent of each. A, B and C are the thesis's.",
  utility: 'The objectives of one walk as one number, by a preference. Less is better.',
} as const

export function Term({ name }: { name: keyof typeof GLOSSARY }) {
  const id = useId()
  return (
    <>
      <button type="button" class="term" popovertarget={id}>
        {name}
      </button>
      <span class="definition" popover="auto" id={id} role="note">
        <b>{name}</b>: {GLOSSARY[name]}
      </span>
    </>
  )
}
