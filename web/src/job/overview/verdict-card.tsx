/** The best design against the published or the start design, in words and by scenario. */

import type { QuantityChange, Verdict } from '../../api/types'
import { Card } from '../../components/card'
import { CopyBlock } from '../../components/copy-button'
import { type Column, Table } from '../../components/table/table'
import { change, formatNumber } from '../../format/number'
import { inWords } from '../../format/words'

export function VerdictCard({ verdict }: { verdict: Verdict }) {
  const { sentences, quantities, widen, relax } = verdict
  const scenarios = [...new Set(quantities.flatMap((q) => Object.keys(q.scenarios)))]
  const columns: readonly Column<string>[] = [
    { key: 'scenario', header: true, value: (scenario) => scenario },
    ...quantities.map((quantity) => quantityColumn(quantity)),
  ]
  return (
    <Card title="Verdict" data={{ 'data-better': verdict.figures.better ?? 0 }}>
      <div class="stack">
        {sentences.map((sentence) => (
          <p key={sentence}>{sentence}</p>
        ))}
        {scenarios.length > 0 && (
          <Table caption="Change against the reference" rows={scenarios} columns={columns} />
        )}
        {widen !== null && (
          <CopyBlock
            label="the command that queues a search within wider bounds"
            text={`${widen} --server ${location.origin}`}
          />
        )}
        {relax != null && (
          <CopyBlock
            label="the command that continues under relaxed constraints"
            text={`${relax} --server ${location.origin}`}
          />
        )}
      </div>
    </Card>
  )
}

function quantityColumn({ name, unit, scenarios }: QuantityChange): Column<string> {
  return {
    key: name,
    label: inWords(name),
    unit,
    numeric: true,
    value: (scenario) => scenarios[scenario]?.value ?? null,
    cell: (scenario) => {
      const figure = scenarios[scenario]
      if (figure === undefined) return formatNumber(null)
      return (
        <span class="compared">
          <span>{formatNumber(figure.value, 3)}</span>
          <span class="small" data-tone={figure.judgement}>
            {change(100 * figure.change, '%', 2)}
          </span>
        </span>
      )
    },
  }
}
