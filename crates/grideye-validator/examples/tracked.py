import sys, json
from pathlib import Path
sys.path.insert(0,'tests/peers/tracked')
import numpy as np, walks, tables
out=Path('target/tracked')
lines=[]
for walk in walks.read([Path('../shared/recordings/tracked/subject1_coat.csv'),Path('../shared/recordings/tracked/subject2.csv')]):
    (out/f'{walk.name}.background').write_text(' '.join(f'{v:.4f}' for v in walk.background_c))
    for i,rows in enumerate(walk.stretches()):
        walks.write_recording(out/f'{walk.name}_{i}.rec.csv',walk,rows)
        walks.write_recording(out/f'{walk.name}_{i}.gone.csv',walk,rows,walk.with_gap(rows))
        for j,(what,claim) in enumerate({**tables.CLAIMS,**tables.SLIGHT}.items()):
            name=f'{walk.name}_{i}_{j}.toml'
            try: walks.write_scene(out/name,walk,rows,**claim)
            except Exception as e: print(what,e); continue
            rec='gone' if what==tables.GONE else 'rec'
            lines.append('\t'.join([what,f'{walk.name}_{i}.{rec}.csv',name,f'{walk.name}.background']))
(out/'list').write_text('\n'.join(lines)+'\n')
print(len(lines))
