/** Choice of the two axes of a chart. */

import { Select } from '../components/fields/controls'
import { inWords } from '../format/words'

interface AxisSelectsProps {
  axes: readonly { readonly name: string }[]
  x: string
  y: string
  onSelect: (axes: { readonly x: string; readonly y: string }) => void
}

export function AxisSelects({ axes, x, y, onSelect }: AxisSelectsProps) {
  const select = (label: string, value: string, other: string, set: (name: string) => void) => (
    <Select
      label={label}
      value={value}
      options={axes.map(({ name }) => [name, inWords(name), name === other] as const)}
      onChoose={set}
    />
  )
  return (
    <>
      {select('Across', x, y, (name) => onSelect({ x: name, y }))}
      {select('Up', y, x, (name) => onSelect({ x, y: name }))}
    </>
  )
}
